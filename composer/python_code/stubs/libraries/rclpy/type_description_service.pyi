from rclpy.node import Node

START_TYPE_DESCRIPTION_SERVICE_PARAM: str

class TypeDescriptionService:
    service_name: str
    enabled: bool
    def __init__(self, node: Node) -> None: ...
    def destroy(self) -> None: ...

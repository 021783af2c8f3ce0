from enum import Enum
from typing import Any

import rcl_interfaces.msg
from rcl_interfaces.msg import ParameterType as ParameterType
from rcl_interfaces.msg import ParameterValue as ParameterValue

PARAMETER_SEPARATOR_STRING: str
ParameterMsg = rcl_interfaces.msg.Parameter

class Parameter:
    class Type(Enum):
        NOT_SET = 0
        BOOL = 1
        INTEGER = 2
        DOUBLE = 3
        STRING = 4
        BYTE_ARRAY = 5
        BOOL_ARRAY = 6
        INTEGER_ARRAY = 7
        DOUBLE_ARRAY = 8
        STRING_ARRAY = 9
        @classmethod
        def from_parameter_value(cls, parameter_value: Any) -> Parameter.Type: ...
        def check(self, parameter_value: Any) -> bool: ...

    def __init__(
        self, name: str, type_: Parameter.Type | None = None, value: Any = None
    ) -> None: ...
    # Comparing identities is never meant: what is compared has to be the value.
    __eq__: None  # type: ignore[assignment]
    __ne__: None  # type: ignore[assignment]
    @property
    def name(self) -> str: ...
    @property
    def type_(self) -> Parameter.Type: ...
    @property
    def value(self) -> Any: ...
    def get_parameter_value(self) -> ParameterValue: ...
    def to_parameter_msg(self) -> ParameterMsg: ...
    @classmethod
    def from_parameter_msg(cls, param_msg: ParameterMsg) -> Parameter: ...

def get_parameter_value(string_value: str) -> ParameterValue: ...
def parameter_value_to_python(parameter_value: ParameterValue) -> Any: ...
def parameter_dict_from_yaml_file(
    parameter_file: str,
    use_wildcard: bool = False,
    target_nodes: list[str] | None = None,
    namespace: str = "",
) -> dict[str, ParameterMsg]: ...

# The compiled module: what other modules give on, and what users name.

from enum import Enum, IntEnum
from typing import Any

class RCUtilsError(RuntimeError): ...
class RMWError(RuntimeError): ...
class RCLError(RuntimeError): ...
class RCLInvalidROSArgsError(RCLError): ...
class UnknownROSArgsError(RuntimeError): ...
class NodeNameNonExistentError(RCLError): ...
class UnsupportedEventTypeError(RCLError): ...
class InvalidHandle(RuntimeError): ...

class SignalHandlerOptions(IntEnum):
    NO = 0
    SIGINT = 1
    SIGTERM = 2
    ALL = 3

class TransitionCallbackReturnType(Enum):
    SUCCESS = 97
    FAILURE = 98
    ERROR = 99
    def to_label(self) -> str: ...

class GoalEvent(IntEnum):
    EXECUTE = 0
    CANCEL_GOAL = 1
    SUCCEED = 2
    ABORT = 3
    CANCELED = 4

class QoSCompatibility(IntEnum):
    OK = 0
    WARNING = 1
    ERROR = 2

def __getattr__(name: str) -> Any: ...

"""The parameters of functions of numpy that nodes often call, of all of its versions since 1.20.

They are written down, so that numpy need not be installed or imported.
"""

from __future__ import annotations

from collections.abc import Mapping

#: The function and its parameters: '=' after an optional one, '*' before those given by name.
_FUNCTIONS = """
all a axis= out= keepdims= * where=
allclose a b rtol= atol= equal_nan=
any a axis= out= keepdims= * where=
argmax a axis= out= * keepdims=
argmin a axis= out= * keepdims=
argsort a axis= kind= order= * stable=
array object dtype= * copy= order= subok= ndmin= ndmax= like=
asarray a dtype= order= * device= copy= like=
average a axis= weights= returned= * keepdims=
bincount x weights= minlength=
column_stack tup
concatenate arrays axis= out= * dtype= casting=
convolve a v mode=
correlate a v mode=
cross a b axisa= axisb= axisc= axis=
cumsum a axis= dtype= out=
diag v k=
diff a n= axis= prepend= append=
digitize x bins right=
dot a b out=
empty shape dtype= order= * device= like=
empty_like prototype dtype= order= subok= shape= * device=
expand_dims a axis
eye N M= k= dtype= order= * device= like=
full shape fill_value dtype= order= * device= like=
full_like a fill_value dtype= order= subok= shape= * device=
hstack tup * dtype= casting=
identity n dtype= * like=
interp x xp fp left= right= period=
isclose a b rtol= atol= equal_nan=
linalg.cholesky a * upper=
linalg.det a
linalg.eig a
linalg.eigh a UPLO=
linalg.inv a
linalg.lstsq a b rcond=
linalg.norm x ord= axis= keepdims=
linalg.pinv a rcond= hermitian= * rtol=
linalg.solve a b
linspace start stop num= endpoint= retstep= dtype= axis= * device=
logspace start stop num= endpoint= base= dtype= axis=
max a axis= out= keepdims= initial= where=
mean a axis= dtype= out= keepdims= * where=
median a axis= out= overwrite_input= keepdims=
min a axis= out= keepdims= initial= where=
nonzero a
ones shape dtype= order= * device= like=
ones_like a dtype= order= subok= shape= * device=
outer a b out=
percentile a q axis= out= overwrite_input= method= keepdims= * weights= interpolation=
polyfit x y deg rcond= full= w= cov=
polyval p x
prod a axis= dtype= out= keepdims= initial= where=
repeat a repeats axis=
roll a shift axis=
searchsorted a v side= sorter=
split ary indices_or_sections axis=
stack arrays axis= out= * dtype= casting=
std a axis= dtype= out= ddof= keepdims= * where= mean= correction=
sum a axis= dtype= out= keepdims= initial= where=
tile A reps
transpose a axes=
unwrap p discont= axis= * period=
var a axis= dtype= out= ddof= keepdims= * where= mean= correction=
vstack tup * dtype= casting=
zeros shape dtype= order= * device= like=
zeros_like a dtype= order= subok= shape= * device=
"""
#: Functions that arrays have as methods, with the same parameters after the array.
_AS_METHODS = (
    "all any argmax argmin argsort cumsum dot max mean min nonzero prod repeat searchsorted std "
    "sum var"
)
#: The functions that take one or two arrays, and options that all of them have.
_OF_ONE = (
    "abs absolute arccos arcsin arctan ceil cos cosh deg2rad degrees exp floor isfinite isinf "
    "isnan log log10 log2 negative rad2deg radians rint sign sin sinh sqrt square tan tanh trunc"
)
_OF_TWO = "add arctan2 divide fmod hypot maximum minimum multiply power subtract"


def _parsed() -> Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]]:
    found: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {}
    for line in _FUNCTIONS.split("\n"):
        name, *parameters = line.split() or [""]
        at = parameters.index("*") if "*" in parameters else len(parameters)
        found[name] = tuple(parameters[:at]), tuple(parameters[at + 1 :])
    del found[""]
    return found


#: By name without ``numpy.``: the parameters by position, and those by name; '=' if optional.
NUMPY_PARAMETERS = _parsed()
#: By name, how many arrays a function takes that works on each element.
NUMPY_ARRAYS: Mapping[str, int] = {
    **dict.fromkeys(_OF_ONE.split(), 1),
    **dict.fromkeys(_OF_TWO.split(), 2),
}
#: By name, the parameters of methods of arrays, by position and by name.
NUMPY_METHODS: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    name: (NUMPY_PARAMETERS[name][0][1:], NUMPY_PARAMETERS[name][1]) for name in _AS_METHODS.split()
} | {
    "astype": (("dtype", "order=", "casting=", "subok=", "copy="), ()),
    "copy": (("order=",), ()),
    "flatten": (("order=",), ()),
    "ravel": (("order=",), ()),
    "tobytes": (("order=",), ()),
    "tolist": ((), ()),
}

// In the ROS wheels, librcl_lifecycle.so is linked with the Python parts of its messages, which a program
// without Python cannot load. It never calls them, so any definition of their variables will do.
extern "C" {
void * PyExc_RuntimeError = nullptr;
void * _Py_NoneStruct = nullptr;
void * _Py_TrueStruct = nullptr;
void * _Py_FalseStruct = nullptr;
}

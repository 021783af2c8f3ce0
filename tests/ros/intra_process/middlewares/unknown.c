/* Preloaded: a middleware with an unknown name. */
#include "rmw/rmw.h"

const char * rmw_get_implementation_identifier(void)
{
  return "rmw_unknown_cpp";
}

/* In front of rmw: a middleware of a name that nobody knows. */
#include "rmw/rmw.h"

const char * rmw_get_implementation_identifier(void)
{
  return "rmw_unheard_of_cpp";
}

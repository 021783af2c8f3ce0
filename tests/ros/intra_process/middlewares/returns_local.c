/* Preloaded: a middleware that ignores ignore_local_publications. */
#include <dlfcn.h>

#include "rmw/rmw.h"

typedef rmw_ret_t (*Take)(
  const rmw_subscription_t *, void *, bool *, rmw_message_info_t *, rmw_subscription_allocation_t *);

rmw_ret_t rmw_take_with_info(
  const rmw_subscription_t * subscription, void * message, bool * taken, rmw_message_info_t * info,
  rmw_subscription_allocation_t * allocation)
{
  /* rmw_implementation loads the middleware in an installation of ROS; the wheels do without it. */
  void * rmw = dlopen("librmw_implementation.so", RTLD_LAZY | RTLD_NOLOAD);
  if (rmw == NULL) {
    rmw = dlopen("librmw_fastrtps_cpp.so", RTLD_LAZY | RTLD_NOLOAD);
  }
  ((rmw_subscription_t *)subscription)->options.ignore_local_publications = false;
  return ((Take)dlsym(rmw, __func__))(subscription, message, taken, info, allocation);
}

/* Prints the offsets of the fields that Python sets. */
#include <stddef.h>
#include <stdio.h>

#include "rmw/types.h"

int main(void)
{
  printf(
    "%zu %zu %zu\n", offsetof(rmw_subscription_t, topic_name),
    offsetof(rmw_subscription_t, options.ignore_local_publications), sizeof(rmw_subscription_t));
  return 0;
}

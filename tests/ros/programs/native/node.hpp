// What both nodes share: a context, a node and a publisher, until SIGINT or SIGTERM.
#pragma once

#include <rcl/error_handling.h>
#include <rcl/rcl.h>
#include <rosidl_runtime_c/string_functions.h>
#include <std_msgs/msg/string.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>

inline std::atomic<bool> stopped{false};

inline void check(rcl_ret_t result, const char * what)
{
  if (result != RCL_RET_OK) {
    std::fprintf(stderr, "%s: %s\n", what, rcl_get_error_string().str);
    std::exit(2);
  }
}

struct Node
{
  rcl_context_t context = rcl_get_zero_initialized_context();
  rcl_node_t node = rcl_get_zero_initialized_node();
  rcl_publisher_t words = rcl_get_zero_initialized_publisher();

  Node(int argc, char ** argv, const char * name)
  {
    std::signal(SIGINT, [](int) {stopped = true;});
    std::signal(SIGTERM, [](int) {stopped = true;});
    rcl_init_options_t options = rcl_get_zero_initialized_init_options();
    check(rcl_init_options_init(&options, rcl_get_default_allocator()), "init options");
    check(rcl_init(argc, argv, &options, &context), "init");
    rcl_node_options_t node_options = rcl_node_get_default_options();
    check(rcl_node_init(&node, name, "", &context, &node_options), "node");
    rcl_publisher_options_t publisher_options = rcl_publisher_get_default_options();
    check(
      rcl_publisher_init(
        &words, &node, ROSIDL_GET_MSG_TYPE_SUPPORT(std_msgs, msg, String), "words",
        &publisher_options), "publisher");
    std::printf("I am %s\n", rcl_node_get_fully_qualified_name(&node));
    std::fflush(stdout);
  }

  ~Node()
  {
    check(rcl_publisher_fini(&words, &node), "publisher");
    check(rcl_node_fini(&node), "node");
    check(rcl_shutdown(&context), "shutdown");
  }

  void publish(const char * text)
  {
    std_msgs__msg__String message;
    std_msgs__msg__String__init(&message);
    rosidl_runtime_c__String__assign(&message.data, text);
    check(rcl_publish(&words, &message, nullptr), "publish");
    std_msgs__msg__String__fini(&message);
  }
};

// A lifecycle node that publishes 20 times a second while it is active.
#include <lifecycle_msgs/msg/transition_event.h>
#include <lifecycle_msgs/srv/change_state.h>
#include <lifecycle_msgs/srv/get_available_states.h>
#include <lifecycle_msgs/srv/get_available_transitions.h>
#include <lifecycle_msgs/srv/get_state.h>
#include <rcl_lifecycle/rcl_lifecycle.h>

#include <string>

#include "node.hpp"

#define SERVICE(name) ROSIDL_GET_SRV_TYPE_SUPPORT(lifecycle_msgs, srv, name)

static bool change_state(
  rcl_lifecycle_state_machine_t & machine, const lifecycle_msgs__msg__Transition & requested)
{
  const rcl_lifecycle_transition_t * transition = requested.label.size > 0 ?
    rcl_lifecycle_get_transition_by_label(machine.current_state, requested.label.data) :
    rcl_lifecycle_get_transition_by_id(machine.current_state, requested.id);
  if (transition == nullptr) {
    return false;
  }
  check(rcl_lifecycle_trigger_transition_by_id(&machine, transition->id, true), "transition");
  check(
    rcl_lifecycle_trigger_transition_by_label(
      &machine, rcl_lifecycle_transition_success_label, true), "success");
  return true;
}

int main(int argc, char ** argv)
{
  Node node(argc, argv, "managed");
  rcl_lifecycle_state_machine_t machine = rcl_lifecycle_get_zero_initialized_state_machine();
  rcl_lifecycle_state_machine_options_t options =
    rcl_lifecycle_get_default_state_machine_options();
  check(
    rcl_lifecycle_state_machine_init(
      &machine, &node.node, ROSIDL_GET_MSG_TYPE_SUPPORT(lifecycle_msgs, msg, TransitionEvent),
      SERVICE(ChangeState), SERVICE(GetState), SERVICE(GetAvailableStates),
      SERVICE(GetAvailableTransitions), SERVICE(GetAvailableTransitions), &options), "machine");
  rcl_service_t * change = &machine.com_interface.srv_change_state;
  rcl_service_t * get = &machine.com_interface.srv_get_state;
  rcl_wait_set_t waiting = rcl_get_zero_initialized_wait_set();
  check(
    rcl_wait_set_init(
      &waiting, 0, 0, 0, 0, 2, 0, &node.context, rcl_get_default_allocator()), "wait set");
  while (!stopped) {
    check(rcl_wait_set_clear(&waiting), "clear");
    check(rcl_wait_set_add_service(&waiting, change, nullptr), "add");
    check(rcl_wait_set_add_service(&waiting, get, nullptr), "add");
    const rcl_ret_t waited = rcl_wait(&waiting, RCL_MS_TO_NS(50));
    if (waited != RCL_RET_TIMEOUT) {check(waited, "wait");}
    rmw_request_id_t id;
    lifecycle_msgs__srv__ChangeState_Request request;
    lifecycle_msgs__srv__ChangeState_Request__init(&request);
    if (rcl_take_request(change, &id, &request) == RCL_RET_OK) {
      lifecycle_msgs__srv__ChangeState_Response response;
      lifecycle_msgs__srv__ChangeState_Response__init(&response);
      response.success = change_state(machine, request.transition);
      check(rcl_send_response(change, &id, &response), "response");
      lifecycle_msgs__srv__ChangeState_Response__fini(&response);
    }
    lifecycle_msgs__srv__ChangeState_Request__fini(&request);
    lifecycle_msgs__srv__GetState_Request empty;
    lifecycle_msgs__srv__GetState_Request__init(&empty);
    if (rcl_take_request(get, &id, &empty) == RCL_RET_OK) {
      lifecycle_msgs__srv__GetState_Response response;
      lifecycle_msgs__srv__GetState_Response__init(&response);
      response.current_state.id = machine.current_state->id;
      rosidl_runtime_c__String__assign(
        &response.current_state.label, machine.current_state->label);
      check(rcl_send_response(get, &id, &response), "response");
      lifecycle_msgs__srv__GetState_Response__fini(&response);
    }
    lifecycle_msgs__srv__GetState_Request__fini(&empty);
    if (std::string(machine.current_state->label) == "active") {
      node.publish("managed");
    }
  }
  check(rcl_wait_set_fini(&waiting), "end");
  return 0;
}

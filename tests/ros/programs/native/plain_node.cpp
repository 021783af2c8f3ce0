// A node that publishes 20 times a second.
#include <chrono>
#include <thread>

#include "node.hpp"

int main(int argc, char ** argv)
{
  Node node(argc, argv, "plain");
  while (!stopped) {
    node.publish("plain");
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return 0;
}

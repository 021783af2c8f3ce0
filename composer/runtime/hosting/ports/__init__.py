"""The publishers, subscriptions, services, clients, actions and timers that a class creates."""

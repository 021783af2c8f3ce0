"""When and how often callbacks run and publish, as far as the declaration determines it."""

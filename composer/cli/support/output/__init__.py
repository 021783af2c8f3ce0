"""What commands print: to a terminal, a pipe or a file, without blocking the program."""

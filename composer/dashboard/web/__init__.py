"""The web server: its sockets and routes, the files of the page, and one connection per browser."""

"""To and from what teams have: imports, exports, launch files, new files from templates."""

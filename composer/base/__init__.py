"""What all packages use: diagnostics, places in files, the nearest valid name, safe reading."""

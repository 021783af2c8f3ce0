"""What commands share: options, tables, progress, terminal output and failures."""

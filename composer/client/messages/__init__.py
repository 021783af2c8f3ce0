"""Messages of any topic: as text, measured, collected, published."""

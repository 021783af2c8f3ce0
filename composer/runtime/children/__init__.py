"""Child processes and their launcher, and the discovery servers among them."""

"""Imported last by the process from which others are forked: what exists now remains.

So the garbage collector of a forked process visits, and thereby copies, none of it.
"""

import gc

gc.collect()
gc.freeze()

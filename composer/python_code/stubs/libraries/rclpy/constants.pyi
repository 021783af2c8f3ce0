S_TO_NS: int

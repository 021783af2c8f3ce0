"""Operations and statements that fail or have no effect."""

"""Model file -> program (IR) -> one source file per target. Imports no torch and no GL."""

"""Output formats for diagnostics: text, JSON, SARIF and GitHub annotations."""

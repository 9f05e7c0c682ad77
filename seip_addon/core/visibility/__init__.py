"""Which candidate pose sees which target: exact, and casting only rays that can matter."""

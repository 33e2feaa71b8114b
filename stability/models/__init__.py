"""The catalogue: every oscillator of the source chapter, and the classics."""

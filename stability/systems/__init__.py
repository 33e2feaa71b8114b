"""What an oscillator is: equations with named states and parameters, and the evaluators that make them fast."""

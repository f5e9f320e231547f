"""What the potential is a sum over: elements, the terms over them, and the derivatives of each element's energy."""

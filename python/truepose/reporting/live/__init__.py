"""The live part of a page: the kernel for browsers, one machine, and sliders."""

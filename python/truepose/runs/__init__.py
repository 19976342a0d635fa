"""A run over poses: which poses, how far the tool is displaced there, and the result's Dataset."""

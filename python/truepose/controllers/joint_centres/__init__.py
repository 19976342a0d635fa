"""A table of joint centres, of no controller: from a drawing, a coordinate measuring machine."""

"""Whether the machine keeps its target: answers that rest on a proof or on a witness."""

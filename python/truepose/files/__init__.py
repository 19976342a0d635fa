"""Reading and writing: text, TOML, CSV, units and tolerances; nothing here knows a machine."""

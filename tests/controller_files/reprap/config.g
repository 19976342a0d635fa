; Own-made sample in the form of a RepRapFirmware 3 config.g
G90                                            ; absolute coordinates
M83                                            ; relative extruder moves
M550 P"sample delta"
M665 L304.500:304.500:304.500 R158.345 H325.871 B140.0 X0.187 Y-0.243 Z0.000 ; delta geometry
M666 X0.412 Y-0.087 Z-0.325 A0.06 B-0.11   ; endstop adjustments, tilt in per cent
M569 P0 S1
M569 P1 S1
M569 P2 S1
M584 X0 Y1 Z2 E3
M350 X16 Y16 Z16 E16 I1
M92 X80.00 Y80.00 Z80.00 E420.00
M203 X18000.00 Y18000.00 Z18000.00 E3600.00
M201 X1000.00 Y1000.00 Z1000.00 E1000.00
M208 Z0 S1                                      ; minimum Z
M574 X2 S1 P"xstop"
M574 Y2 S1 P"ystop"
M574 Z2 S1 P"zstop"
M558 P5 C"zprobe.in" H5 F120 T6000
G31 P500 X0 Y0 Z-0.20
M557 R85 S20

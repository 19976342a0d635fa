; RepRapFirmware parameters of 'Linear delta', fitted by truepose 0.1.0
; machine file linear_delta.toml, SHA-256 b91b126ccaafd65a430eb1d05ce47778cedcf21ee8880ba398297976eb84547c
; left over with these numbers: at most 0.3 um (at x = -80 mm, y = 80 mm, z = 100 mm), rms 0.1 um
; with the nominal machine's numbers: at most 2.6 um (at x = -80 mm, y = 80 mm, z = 100 mm), rms 2.3 um
; over 125 poses of the workspace, in this condition: temperature 45 degC; reference 20 degC; force 3 N, 2 N, 4 N
; besides, the platform turns by up to 20.3 urad (before: 20.3 urad) more than as designed, which this controller cannot command
; switches trip at a 580 mm, b 580 mm, c 580 mm
; towers: X a, Y b, Z c; B is the workspace's radius, not fitted
M665 L332.99612:332.99595:332.99652 R174.74830 H296.53868 B113.2 X0.000054 Y0.000098 Z-0.000137
M666 X-0.00065 Y0.00050 Z0.00015 A-0.000002 B0.000057

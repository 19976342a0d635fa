// Own-made excerpt in the form of a Marlin 2 Configuration.h
#define DELTA
#if ENABLED(DELTA)
  #define DEFAULT_SEGMENTS_PER_SECOND 80
  #define DELTA_PRINTABLE_RADIUS 90.0    // (mm)
  #define DELTA_MAX_RADIUS       90.0    // (mm)
  #define DELTA_DIAGONAL_ROD 215.0        // (mm)
  #define DELTA_HEIGHT 232.15             // (mm)
  #define DELTA_ENDSTOP_ADJ { -0.34, 0.0, -0.57 } // (mm)
  #define DELTA_RADIUS 106.2              // (mm)
  #define DELTA_TOWER_ANGLE_TRIM { 0.31, -0.22, 0.0 } // (degrees)
  #define DELTA_RADIUS_TRIM_TOWER { 0.0, 0.0, 0.0 } // (mm)
  #define DELTA_DIAGONAL_ROD_TRIM_TOWER { 0.05, -0.08, 0.0 } // (mm)
#endif
#define XYZ_FULL_STEPS_PER_ROTATION 200
#define XYZ_MICROSTEPS 16
#define XYZ_BELT_PITCH 2
#define XYZ_PULLEY_TEETH 20
#define DEFAULT_XYZ_STEPS_PER_UNIT ((XYZ_FULL_STEPS_PER_ROTATION) * (XYZ_MICROSTEPS) / double(XYZ_BELT_PITCH) / double(XYZ_PULLEY_TEETH))
#define DEFAULT_AXIS_STEPS_PER_UNIT { DEFAULT_XYZ_STEPS_PER_UNIT, DEFAULT_XYZ_STEPS_PER_UNIT, DEFAULT_XYZ_STEPS_PER_UNIT, 96.2751 }
#define X_HOME_DIR 1
#define Y_HOME_DIR 1
#define Z_HOME_DIR 1
#define NOZZLE_TO_PROBE_OFFSET { 0, 0, -0.15 }

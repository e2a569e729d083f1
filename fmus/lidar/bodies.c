#include "bodies.h"

/* Proportions of common designs; sloping screens are replaced by upright ones at half their height,
 * which keeps the area of the side view. Everything reaches down to the ground or to another part:
 * there is no view under a vehicle. docs/physics-lidar.md discusses both. */
static const struct {
    size_t count;
    BodyPart parts[BODY_PARTS_MAXIMUM];
} BODIES[BODY_CLASSES] = {
    /*            rear   front  width  bottom top */
    [BODY_CAR] = {2,
                  {{-0.50, 0.50, 1.00, 0.00, 0.62},    /* up to the waistline, bonnet, boot */
                   {-0.36, 0.16, 0.85, 0.62, 1.00}}},  /* cabin */
    [BODY_SUV] = {2,
                  {{-0.50, 0.50, 1.00, 0.00, 0.62},
                   {-0.48, 0.20, 0.88, 0.62, 1.00}}},  /* cabin to the tail gate */
    [BODY_VAN] = {2,
                  {{-0.50, 0.50, 1.00, 0.00, 0.50},
                   {-0.50, 0.36, 1.00, 0.50, 1.00}}},  /* all but the short bonnet */
    [BODY_BUS] = {1, {{-0.50, 0.50, 1.00, 0.00, 1.00}}},
    [BODY_TRUCK] = {3,
                    {{-0.50, 0.50, 1.00, 0.00, 0.30},  /* chassis, wheels, side guards */
                     {0.28, 0.50, 1.00, 0.30, 0.90},   /* driver's cab */
                     {-0.50, 0.24, 1.00, 0.30, 1.00}}}, /* cargo box, with a gap to the cab */
};

const BodyPart *body_parts(int32_t body, size_t *count) {
    *count = BODIES[body].count;
    return BODIES[body].parts;
}

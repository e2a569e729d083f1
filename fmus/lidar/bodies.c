#include "bodies.h"

#include "records.h"

/* Proportions of common designs; sloping screens are replaced by upright ones at half their height,
 * which keeps the area of the side view. All but the feet on pedals and footrests reaches down to the
 * ground or to another part: there is no view under a vehicle. docs/physics-lidar.md has the sources. */
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
    [BODY_RAIL] = {3,
                   {{-0.49, 0.49, 0.85, 0.00, 0.12},   /* bogies and underframe */
                    {-0.50, 0.50, 1.00, 0.12, 0.88},
                    {-0.45, 0.45, 0.70, 0.88, 1.00}}}, /* what stands on the roof */
    [BODY_MOTORCYCLE] = {4,
                         {{-0.50, 0.50, 0.35, 0.00, 0.53},   /* wheels, engine, tank, seat */
                          {-0.15, 0.15, 0.65, 0.18, 0.53},   /* legs */
                          {-0.20, 0.18, 0.60, 0.53, 0.83},   /* trunk and arms */
                          {-0.02, 0.12, 0.28, 0.83, 1.00}}}, /* helmet */
    [BODY_BICYCLE] = {4,
                      {{-0.50, 0.50, 0.12, 0.00, 0.41},   /* wheels and frame */
                       {-0.15, 0.15, 0.55, 0.06, 0.56},   /* legs */
                       {-0.20, 0.22, 0.75, 0.56, 0.84},   /* trunk and arms */
                       {0.05, 0.20, 0.25, 0.84, 1.00}}},  /* head */
    [BODY_PEDESTRIAN] = {3,
                         {{-0.50, 0.50, 0.70, 0.00, 0.48},   /* legs */
                          {-0.50, 0.50, 1.00, 0.48, 0.82},   /* trunk and arms */
                          {-0.45, 0.45, 0.32, 0.82, 1.00}}}, /* head */
};

const BodyPart *body_parts(int32_t body, size_t *count) {
    *count = BODIES[body].count;
    return BODIES[body].parts;
}

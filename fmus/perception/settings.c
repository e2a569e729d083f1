#include "settings.h"

#include "variables.h"

#include <math.h>

/* Items of `message`. */
enum { PLAIN = 1, COMPRESSED };

/* Items of `scans`. */
enum { ALL_SCANS = 1, EGO_SCAN };

int64_t nanoseconds(double seconds) { return (int64_t)floor(seconds * 1e9 + 0.5); }

static int segmentation_of(Instance *instance) {
    return (int)int64(instance, VR_segmentation);
}

static BoxKind boxes_of(Instance *instance) { return (BoxKind)int64(instance, VR_boxes); }

Settings settings_of(Instance *i) {
    const int has_area = int64(i, VR_index) == SEEN_AREA;
    return (Settings){
        .matrix = {.rows = natural(i, VR_rows), .columns = natural(i, VR_columns),
                   .cell = real(i, VR_cell), .offset = real(i, VR_offset),
                   .floor = real(i, VR_floor), .ceiling = real(i, VR_ceiling),
                   .ground_height = real(i, VR_ground_height),
                   .levels = has_area ? natural(i, VR_index_levels) : 0,
                   .blanking = real(i, VR_blanking), .map_margin = real(i, VR_map_margin),
                   .segmentation = segmentation_of(i),
                   .has_spots = boxes_of(i) == FITTED,
                   .segment = {.adjacent = real(i, VR_azimuth_gap) * (PI / 180),
                               .depth_gap = real(i, VR_depth_gap), .reach = real(i, VR_reach),
                               .roof_gap = real(i, VR_roof_gap),
                               .length = real(i, VR_vehicle_length),
                               .width = real(i, VR_vehicle_width),
                               .height = real(i, VR_vehicle_height),
                               .car_length = real(i, VR_car_length),
                               .car_width = real(i, VR_car_width),
                               .car_height = real(i, VR_car_height)}},
        .pattern = {.azimuths = natural(i, VR_azimuths), .channels = natural(i, VR_channels),
                    .elevation_top = real(i, VR_elevation_top),
                    .elevation_bottom = real(i, VR_elevation_bottom), .range = real(i, VR_range)},
        .object = {.minimum_points = natural(i, VR_minimum_points),
                   .has_labels = segmentation_of(i) == BY_LABELS, .boxes = boxes_of(i),
                   .track = {.memory = natural(i, VR_track_memory),
                             .timeout = nanoseconds(real(i, VR_track_timeout)),
                             .gate = real(i, VR_gate), .fastest = real(i, VR_fastest),
                             .has_doubts = boxes_of(i) == FITTED}},
        .zone = {.window_smallest = natural(i, VR_window_smallest),
                 .window_largest = natural(i, VR_window_largest),
                 .threshold = has_area ? real(i, VR_seen_threshold) : real(i, VR_threshold),
                 .threshold_exponent = has_area ? 0 : natural(i, VR_threshold_exponent),
                 .threshold_distance = real(i, VR_threshold_distance),
                 .region_share = real(i, VR_region_share),
                 .overlap = real(i, VR_zone_overlap)},
        .region = {.resolution = real(i, VR_region_resolution), .corridor = real(i, VR_corridor),
                   .near_field = real(i, VR_near_field), .horizon = real(i, VR_horizon)},
        .has_region_benefit = boolean(i, VR_region_benefit),
        .match = {.maximum_age = nanoseconds(real(i, VR_maximum_age)),
                  .hold = nanoseconds(real(i, VR_hold)),
                  .maximum_offset = real(i, VR_maximum_offset),
                  .index_limit = natural(i, VR_index_limit),
                  .benefit_threshold = real(
                      i, has_area ? VR_seen_benefit_threshold : VR_benefit_threshold),
                  .index = has_area ? SEEN_AREA : POINTS,
                  .release_ratio = real(i, VR_release_ratio),
                  .switch_margin = real(i, VR_switch_margin)},
        .has_layer = boolean(i, VR_layer),
        .is_compressed = int64(i, VR_message) == COMPRESSED,
        .is_ego_alone = int64(i, VR_scans) == EGO_SCAN,
    };
}

int settings_check(const Settings *settings, Problem *problem) {
    const ZoneSettings *zone = &settings->zone;
    const PatternSettings *pattern = &settings->pattern;
    if (zone->window_smallest > zone->window_largest)
        return fail(problem, "window_smallest is %u cells, must not exceed window_largest, %u",
                    (unsigned)zone->window_smallest, (unsigned)zone->window_largest);
    if (settings->matrix.levels > 0 && pattern->elevation_top < pattern->elevation_bottom)
        return fail(problem, "elevation_top is %g rad, must not be below elevation_bottom, %g rad",
                    pattern->elevation_top, pattern->elevation_bottom);
    return 0;
}

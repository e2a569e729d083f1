/* Which part of each cell a sensor sees: the ground between its returns, instead of their number.
 *
 * The returns of one azimuth are followed from the vehicle outwards. A return from the ground shows
 * the ground half-way to the next lower and the next higher channel; where the next higher channel
 * meets an obstacle instead, it shows the ground up to there. */
#ifndef SEEN_H
#define SEEN_H
#include "scan.h"

/* The directions in which the sensors measure, as the lidar unit has them. */
typedef struct {
    uint32_t azimuths, channels;
    double elevation_top, elevation_bottom; /* [rad] */
    double range;                           /* [m] */
} PatternSettings;

/* Cosine and sine. */
typedef struct {
    double cosine, sine;
} Direction;

/* Where the border between two channels meets the ground, levelled frame. */
typedef struct {
    Direction direction;
    double distance; /* [m], at most the largest one */
    double turn;     /* change of the direction per change of the azimuth, 1 for a level sensor */
} Limit;

/* What came back from one direction. */
typedef enum { NO_ECHO, GROUND_ECHO, OBSTACLE_ECHO } Echo;

typedef struct {
    PatternSettings pattern; /* that the tables belong to */
    Direction *azimuth;      /* of each azimuth */
    Direction *border;       /* elevations above and below each channel, channels + 1, descending */
    double *slope;           /* their tangents */
    uint8_t *returns;        /* azimuths x channels, an Echo */
    double *distance;        /* of each return, along the ground [m] */
    double *area;            /* rows x columns [m^2] */
    Limit *limit;            /* of each border, for one azimuth */
    size_t azimuth_capacity, border_capacity, slope_capacity, return_capacity, distance_capacity,
        area_capacity, limit_capacity;
} Seen;

/* Write to `cells` (rows x columns) how much of each cell's ground the scan shows, in 1/levels. The
 * points are those that scan_take has accepted. */
int seen_take(Seen *, const PatternSettings *, const ScanSettings *, const Cloud *, const Sensor *,
              uint32_t levels, uint32_t *cells, Problem *);
void seen_free(Seen *);

#endif

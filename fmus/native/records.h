/* The Binary signals of fmus/messages/records.py in C; see there for what each member means.
 * Little-endian, packed as declared (every member is naturally aligned except where a comment says
 * otherwise); a frame may start at any address, so copy records with memcpy. */
#ifndef RECORDS_H
#define RECORDS_H
#include <stdint.h>

#define NO_VEHICLE (-1)
#define GROUND (-1)
#define BUILDING (-2)

typedef struct { char magic[4]; uint32_t version, count, record_size; } Frame;

typedef struct {
    int64_t vehicle, time;
    double position[3], heading, pitch, roll;
    uint32_t first, count;
} Sensor;
typedef struct { float position[3], intensity; int32_t instance; } Point;

typedef struct {
    int64_t sensor, time, instance, points;
    double minimum[2], maximum[2], height, velocity[2];
} Object;

typedef struct {
    char magic[4];
    uint16_t version, flags;
    int64_t vehicle, time;
    double position[2], heading, center[2];
    float cell;
    uint16_t rows, columns;
} ApmHeader;
typedef struct { uint8_t height; int8_t vx, vy; uint8_t points; } ApmLayerCell;
#define APM_LAYER_FLAG 1u
#define APM_COMPRESSED_FLAG 2u
#define APM_LEVELS 0xff00u
#define APM_LEVELS_SHIFT 8
#define APM_MOST_CELLS (1u << 20)

typedef struct {
    int64_t id, time, source, destination, route[2], duration;
    double power_offset;
    uint32_t size;
    uint8_t access_category, kind;
    int16_t channel_offset;
} Packet;
typedef struct {
    int64_t packet, time, transmitter, receiver;
    double power_dbm, snir_db;
    uint8_t hop, outcome, link, kind, addressed, reserved[3];
} Reception;
typedef struct {
    int64_t packet, time, queued, transmitter;
    int32_t duration;
    uint8_t hop, fate, access_category, kind;
} TransmissionRecord;
enum { BSM, APM, SENSOR_DATA, REQUEST, NOISE };
enum { SENT, QUEUE_FULL, EXPIRED, GONE };
enum { RECEIVED, LOST_NOISE, LOST_COLLISION, LOST_BUSY, LOST_TRANSMITTING, LOST_WEAK };
enum { LOS, NLOSV, NLOSB };

_Static_assert(sizeof(Frame) == 16, "Frame");
_Static_assert(sizeof(Sensor) == 72, "Sensor");
_Static_assert(sizeof(Point) == 20, "Point");
_Static_assert(sizeof(Object) == 88, "Object");
_Static_assert(sizeof(ApmHeader) == 72, "ApmHeader");
_Static_assert(sizeof(ApmLayerCell) == 4, "ApmLayerCell");
_Static_assert(sizeof(Packet) == 72, "Packet");
_Static_assert(sizeof(Reception) == 56, "Reception");
_Static_assert(sizeof(TransmissionRecord) == 40, "TransmissionRecord");

#endif

#include "cloud.h"

#include <math.h>
#include <string.h>

static int check_frame(Cloud *cloud, const uint8_t *bytes, size_t size, Problem *problem) {
    Frame frame;
    if (size < sizeof frame)
        return fail(problem, "points: a frame has at least 16 bytes, not %zu", size);
    memcpy(&frame, bytes, sizeof frame);
    if (memcmp(frame.magic, "LPTS", 4) != 0 || frame.version != 1)
        return fail(problem, "points: not an `LPTS` frame of version 1");
    if (frame.record_size != sizeof(Sensor))
        return fail(problem, "points: sensor records have %zu bytes, not %u", sizeof(Sensor),
                    (unsigned)frame.record_size);
    size_t rest = size - sizeof frame;
    if (frame.count > rest / sizeof(Sensor))
        return fail(problem, "points: the frame of %u sensors is cut short at %zu bytes",
                    (unsigned)frame.count, size);
    rest -= frame.count * sizeof(Sensor);
    if (rest % sizeof(Point) != 0)
        return fail(problem, "points: %zu bytes after the sensors are no whole number of points "
                    "of %zu bytes", rest, sizeof(Point));
    cloud->sensor_count = frame.count;
    cloud->point_count = rest / sizeof(Point);
    cloud->sensors = bytes + sizeof frame;
    cloud->points = cloud->sensors + frame.count * sizeof(Sensor);
    return 0;
}

static int check_sensor(const Cloud *cloud, size_t index, Problem *problem) {
    Sensor sensor = cloud_sensor(cloud, index);
    if (sensor.vehicle < 0 || sensor.vehicle > INT32_MAX)
        return fail(problem, "points: sensor %zu is on vehicle %lld, must be 0..2^31-1", index,
                    (long long)sensor.vehicle);
    if (sensor.time < 0 || sensor.time > TIME_LIMIT)
        return fail(problem, "points: the scan of vehicle %lld was taken at %lld ns",
                    (long long)sensor.vehicle, (long long)sensor.time);
    for (size_t i = 0; i < index; i++)
        if (cloud_sensor(cloud, i).vehicle == sensor.vehicle)
            return fail(problem, "points: sensors %zu and %zu are both on vehicle %lld; merge "
                        "their points into one scan", i, index, (long long)sensor.vehicle);
    for (size_t i = 0; i < 3; i++)
        if (!isfinite(sensor.position[i]))
            return fail(problem, "points: position[%zu] of the sensor of vehicle %lld is %g", i,
                        (long long)sensor.vehicle, sensor.position[i]);
    double angles[] = {sensor.heading, sensor.pitch, sensor.roll};
    static const char *const NAMES[] = {"heading", "pitch", "roll"};
    for (size_t i = 0; i < 3; i++)
        if (!(fabs(angles[i]) <= ANGLE_LIMIT))
            return fail(problem, "points: %s of the sensor of vehicle %lld is %g", NAMES[i],
                        (long long)sensor.vehicle, angles[i]);
    if ((uint64_t)sensor.first + sensor.count > cloud->point_count)
        return fail(problem, "points: the sensor of vehicle %lld has points %u..%llu, but there "
                    "are %zu", (long long)sensor.vehicle, (unsigned)sensor.first,
                    (unsigned long long)sensor.first + sensor.count, cloud->point_count);
    return 0;
}

int cloud_open(Cloud *cloud, const uint8_t *bytes, size_t size, Problem *problem) {
    *cloud = (Cloud){0};
    if (size == 0) return 0;
    if (check_frame(cloud, bytes, size, problem)) return 1;
    for (size_t i = 0; i < cloud->sensor_count; i++)
        if (check_sensor(cloud, i, problem)) return 1;
    return 0;
}

Sensor cloud_sensor(const Cloud *cloud, size_t index) {
    Sensor sensor;
    memcpy(&sensor, cloud->sensors + index * sizeof sensor, sizeof sensor);
    return sensor;
}

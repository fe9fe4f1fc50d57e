/* Stand-ins for the makers' libraries, written from their documented interfaces alone: the C
   compiler, not our ctypes declarations, says here where each field lies. One person, or two hands,
   walks one step (0.01 m) a frame along x. */
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static int frames_left = 0, opened = 0, closed = 0, waiting = 0, most_waiting = 0, step = 0;
static int plugged = 1;

void fake_reset(int frames) {
    frames_left = frames; opened = closed = waiting = most_waiting = step = 0; plugged = 1;
}
void fake_plug(int there) { plugged = there; }
int fake_opened(void) { return opened; }
int fake_closed(void) { return closed; }
int fake_most_waiting(void) { return most_waiting; }

static bool next_frame(void) {
    if (frames_left <= 0) { usleep(2000); return false; }
    frames_left--; step++;
    return true;
}

/* ---- Kinect10.dll ---- */
typedef struct { float x, y, z, w; } Vector4;
typedef struct {
    int32_t eTrackingState; uint32_t dwTrackingID, dwEnrollmentIndex, dwUserIndex;
    Vector4 Position; Vector4 SkeletonPositions[20];
    int32_t eSkeletonPositionTrackingState[20]; uint32_t dwQualityFlags;
} NUI_SKELETON_DATA;
#pragma pack(push, 16)
typedef struct {
    int64_t liTimeStamp; uint32_t dwFrameNumber, dwFlags;
    Vector4 vFloorClipPlane, vNormalToGravity; NUI_SKELETON_DATA SkeletonData[6];
} NUI_SKELETON_FRAME;
#pragma pack(pop)
typedef struct { float M[16]; Vector4 rotationQuaternion; } NUI_SKELETON_BONE_ROTATION;
typedef struct {
    int32_t endJoint, startJoint;
    NUI_SKELETON_BONE_ROTATION hierarchicalRotation, absoluteRotation;
} NUI_SKELETON_BONE_ORIENTATION;
_Static_assert(sizeof(NUI_SKELETON_FRAME) == 2664, "NUI_SKELETON_FRAME");
_Static_assert(sizeof(NUI_SKELETON_BONE_ORIENTATION) == 168, "NUI_SKELETON_BONE_ORIENTATION");

uint32_t NuiInitialize(uint32_t flags) { opened++; return plugged && flags == 8 ? 0 : 0x83010014; }
uint32_t NuiSkeletonTrackingEnable(void *event, uint32_t flags) {
    return event || (flags & ~4u) ? 0x80070057 : 0;
}
void NuiShutdown(void) { closed++; }
uint32_t NuiSkeletonGetNextFrame(uint32_t wait, NUI_SKELETON_FRAME *frame) {
    (void)wait;
    if (!plugged) return 0x8007048F;
    if (!next_frame()) return 0x83010001;
    memset(frame, 0, sizeof *frame);
    frame->liTimeStamp = 33 * step;
    frame->vFloorClipPlane = (Vector4){0, 1, 0, 0.75f};
    NUI_SKELETON_DATA *place_only = &frame->SkeletonData[0], *person = &frame->SkeletonData[3];
    place_only->eTrackingState = 1; place_only->dwTrackingID = 9;
    person->eTrackingState = 2; person->dwTrackingID = 77;
    for (int j = 0; j < 20; j++) {
        person->SkeletonPositions[j] = (Vector4){0.01f * step, 0.05f * j, 2.0f, 1.0f};
        person->eSkeletonPositionTrackingState[j] = j % 3;
    }
    return 0;
}
uint32_t NuiSkeletonCalculateBoneOrientations(const NUI_SKELETON_DATA *person,
                                              NUI_SKELETON_BONE_ORIENTATION *bones) {
    if (person->eTrackingState != 2) return 0x80070057;
    for (int j = 0; j < 20; j++) {
        bones[j].endJoint = j; bones[j].startJoint = j ? j - 1 : 0;
        bones[j].absoluteRotation.rotationQuaternion = (Vector4){0, 0, 0, j ? 1 : 0};
    }
    return 0;
}

/* ---- Kinect20.dll: interfaces are pointers to tables of functions ---- */
typedef struct Thing { void *const *table; } Thing;
typedef struct { int32_t JointType; float X, Y, Z; int32_t TrackingState; } Joint;
typedef struct { int32_t JointType; Vector4 Orientation; } JointOrientation;
_Static_assert(sizeof(Joint) == 20 && sizeof(JointOrientation) == 20, "Joint");

static uint32_t wrong(void) { fprintf(stderr, "a method that is not needed was called\n"); return 0x80004001; }
static uint32_t add_reference(Thing *thing) { (void)thing; opened++; return 1; }
static uint32_t release(Thing *thing) { (void)thing; closed++; return 0; }
#define UNKNOWN (void *)wrong, (void *)add_reference, (void *)release
#define W (void *)wrong

static uint32_t body_joints(Thing *body, uint32_t count, Joint *joints) {
    (void)body;
    if (count != 25) return 0x80070057;
    for (int j = 0; j < 25; j++)
        joints[j] = (Joint){j, 0.01f * step, 0.05f * j - 0.3f, 2.0f, j % 3};
    return 0;
}
static uint32_t body_turns(Thing *body, uint32_t count, JointOrientation *turns) {
    (void)body;
    if (count != 25) return 0x80070057;
    for (int j = 0; j < 25; j++)
        turns[j] = (JointOrientation){j, {0, 0, 0, j == 3 ? 0 : 1}};
    return 0;
}
static uint32_t body_id(Thing *body, uint64_t *id) { (void)body; *id = 72057594037927941ull; return 0; }
static uint32_t body_tracked(Thing *body, uint8_t *tracked) { (void)body; *tracked = 1; return 0; }
static uint32_t body_untracked(Thing *body, uint8_t *tracked) { (void)body; *tracked = 0; return 0; }
static void *const body_table[] = {UNKNOWN, (void *)body_joints, (void *)body_turns,
    W, W, W, W, W, W, W, W, W, (void *)body_id, (void *)body_tracked, W, W, W};
static void *const nobody_table[] = {UNKNOWN, W, W,
    W, W, W, W, W, W, W, W, W, W, (void *)body_untracked, W, W, W};
static Thing body = {body_table}, nobody = {nobody_table};

static uint32_t frame_bodies(Thing *frame, uint32_t count, Thing **bodies) {
    (void)frame;
    if (count != 6) return 0x80070057;
    for (int b = 0; b < 6; b++)
        if (!bodies[b]) { bodies[b] = b == 4 ? &body : &nobody; opened++; }
    return 0;
}
static uint32_t frame_floor(Thing *frame, Vector4 *plane) {
    (void)frame; *plane = (Vector4){0, 0.8f, 0.6f, 1.5f}; return 0;
}
static uint32_t frame_time(Thing *frame, int64_t *time) { (void)frame; *time = 333333ll * step; return 0; }
static void *const frame_table[] = {UNKNOWN, (void *)frame_bodies, (void *)frame_floor, (void *)frame_time, W};
static Thing frame = {frame_table};

static uint32_t reader_latest(Thing *reader, Thing **latest) {
    (void)reader;
    if (!next_frame()) return 0x8000000A;
    opened++; *latest = &frame;
    return 0;
}
static void *const reader_table[] = {UNKNOWN, W, W, W, (void *)reader_latest, W, W, W};
static Thing reader = {reader_table};

static uint32_t source_open(Thing *source, Thing **opened_reader) {
    (void)source; opened++; *opened_reader = &reader; return 0;
}
static void *const source_table[] = {UNKNOWN, W, W, W, W, W, (void *)source_open, W, W};
static Thing source = {source_table};

static uint32_t sensor_open(Thing *sensor) { (void)sensor; return plugged ? 0 : 0x80004005; }
static uint32_t sensor_close(Thing *sensor) { (void)sensor; return 0; }
static uint32_t sensor_available(Thing *sensor, uint8_t *there) { (void)sensor; *there = plugged; return 0; }
static uint32_t sensor_bodies(Thing *sensor, Thing **opened_source) {
    (void)sensor; opened++; *opened_source = &source; return 0;
}
static void *const sensor_table[] = {UNKNOWN, W, W, W, (void *)sensor_open, (void *)sensor_close, W,
    (void *)sensor_available, W, W, (void *)sensor_bodies, W, W, W, W, W, W, W, W};
static Thing sensor = {sensor_table};
uint32_t GetDefaultKinectSensor(Thing **default_sensor) { opened++; *default_sensor = &sensor; return 0; }

/* ---- k4a and k4abt ---- */
typedef struct { float xyz[3]; float wxyz[4]; int32_t confidence_level; } k4abt_joint_t;
typedef struct { k4abt_joint_t joints[32]; } k4abt_skeleton_t;
typedef struct {
    int32_t color_format, color_resolution, depth_mode, camera_fps; bool synchronized_images_only;
    int32_t depth_delay_off_color_usec, wired_sync_mode; uint32_t subordinate_delay_off_master_usec;
    bool disable_streaming_indicator;
} k4a_device_configuration_t;
typedef struct {
    int32_t sensor_orientation, processing_mode, gpu_device_id; const char *model_path;
} k4abt_tracker_configuration_t;
typedef struct {
    float temperature; float acc[3]; uint64_t acc_time; float gyro[3]; uint64_t gyro_time;
} k4a_imu_sample_t;
_Static_assert(sizeof(k4abt_skeleton_t) == 1024, "k4abt_skeleton_t");
_Static_assert(sizeof(k4a_device_configuration_t) == 36, "k4a_device_configuration_t");
_Static_assert(sizeof(k4abt_tracker_configuration_t) == 24, "k4abt_tracker_configuration_t");
_Static_assert(sizeof(k4a_imu_sample_t) == 48, "k4a_imu_sample_t");
static int camera, captured, tracked;

uint32_t k4a_device_open(uint32_t index, void **device) {
    if (!plugged || index > 1) return 1;
    opened++; *device = &camera;
    return 0;
}
void k4a_device_close(void *device) { closed += device == &camera; }
uint32_t k4a_device_start_cameras(void *device, k4a_device_configuration_t *c) {
    return !(device == &camera && c->depth_mode == 2 && c->camera_fps == 2 && c->color_resolution == 0
             && !c->synchronized_images_only && !c->disable_streaming_indicator);
}
void k4a_device_stop_cameras(void *device) { (void)device; }
uint32_t k4a_device_start_imu(void *device) { return device != &camera; }
void k4a_device_stop_imu(void *device) { (void)device; }
uint32_t k4a_device_get_imu_sample(void *device, k4a_imu_sample_t *sample, int32_t wait) {
    (void)device; (void)wait;
    *sample = (k4a_imu_sample_t){.temperature = 30, .acc = {0, 0, 9.81f}};
    return 0;
}
uint32_t k4a_device_get_calibration(void *device, int32_t depth, int32_t color, uint8_t *calibration) {
    (void)device; (void)depth; (void)color; memset(calibration, 7, 1032);
    return 0;
}
/* The accelerometer's z axis is the depth camera's -y: the camera stands level. */
uint32_t k4a_calibration_3d_to_3d(const uint8_t *calibration, const float *point, int32_t from,
                                  int32_t to, float *out) {
    if (calibration[1031] != 7 || from != 3 || to != 0) return 1;
    out[0] = point[0] + 5; out[1] = -point[2] - 50; out[2] = point[1] + 2;
    return 0;
}
uint32_t k4a_device_get_capture(void *device, void **capture, int32_t wait) {
    (void)device; (void)wait;
    if (!plugged) return 1;
    if (!next_frame()) return 2;
    usleep(500);
    opened++; *capture = &captured;
    return 0;
}
void k4a_capture_release(void *capture) { closed += capture == &captured; }
uint32_t k4abt_tracker_create(uint8_t *calibration, k4abt_tracker_configuration_t c, void **tracker) {
    if (calibration[0] != 7 || c.processing_mode != 1 || c.model_path || c.gpu_device_id) return 1;
    opened++; *tracker = &tracked;
    return 0;
}
void k4abt_tracker_set_temporal_smoothing(void *tracker, float factor) { (void)tracker; (void)factor; }
uint32_t k4abt_tracker_enqueue_capture(void *tracker, void *capture, int32_t wait) {
    (void)wait;
    if (tracker != &tracked || capture != &captured) return 1;
    waiting++;
    if (waiting > most_waiting) most_waiting = waiting;
    return 0;
}
uint32_t k4abt_tracker_pop_result(void *tracker, void **result, int32_t wait) {
    (void)tracker; (void)wait;
    static int asked = 0;
    usleep(2000); /* the tracker is slower than the camera, and than whoever waits for it */
    if (!waiting || ++asked % 3) return 2;
    waiting--; opened++; *result = &tracked;
    return 0;
}
void k4abt_tracker_shutdown(void *tracker) { (void)tracker; }
void k4abt_tracker_destroy(void *tracker) { closed += tracker == &tracked; }
uint32_t k4abt_frame_get_num_bodies(void *result) { (void)result; return 2; }
uint32_t k4abt_frame_get_body_id(void *result, uint32_t index) { (void)result; return 40 + index; }
uint32_t k4abt_frame_get_body_skeleton(void *result, uint32_t index, k4abt_skeleton_t *skeleton) {
    (void)result;
    for (int j = 0; j < 32; j++)
        skeleton->joints[j] = (k4abt_joint_t){
            {10.0f * step + 1000.0f * index, 500.0f - 20.0f * j, 2000.0f}, {1, 0, 0, 0}, j % 3};
    return 0;
}
uint64_t k4abt_frame_get_device_timestamp_usec(void *result) { (void)result; return 33333ull * step; }
void k4abt_frame_release(void *result) { closed += result == &tracked; }

/* ---- LeapC ---- */
#pragma pack(push, 1)
typedef struct { float prev[3], next[3], width, rotation[4]; } LEAP_BONE;
typedef struct { int32_t finger_id; LEAP_BONE bones[4]; uint32_t is_extended; } LEAP_DIGIT;
typedef struct {
    float position[3], stabilized[3], velocity[3], normal[3], width, direction[3], orientation[4];
} LEAP_PALM;
typedef struct {
    uint32_t id, flags; int32_t type; float confidence; uint64_t visible_time;
    float pinch_distance, grab_angle, pinch_strength, grab_strength;
    LEAP_PALM palm; LEAP_DIGIT digits[5]; LEAP_BONE arm;
} LEAP_HAND;
typedef struct { void *reserved; int64_t frame_id, timestamp; } LEAP_FRAME_HEADER;
typedef struct {
    LEAP_FRAME_HEADER info; int64_t tracking_frame_id; uint32_t nHands; LEAP_HAND *pHands; float framerate;
} LEAP_TRACKING_EVENT;
typedef struct { uint32_t size; int32_t type; const void *pointer; uint32_t device_id; } LEAP_CONNECTION_MESSAGE;
#pragma pack(pop)
_Static_assert(sizeof(LEAP_HAND) == 1084, "LEAP_HAND");
_Static_assert(sizeof(LEAP_TRACKING_EVENT) == 48, "LEAP_TRACKING_EVENT");
_Static_assert(sizeof(LEAP_CONNECTION_MESSAGE) == 20, "LEAP_CONNECTION_MESSAGE");
static int connection, told, background;
static LEAP_HAND hands[2];
static LEAP_TRACKING_EVENT event;

uint32_t LeapCreateConnection(const void *config, void **made) {
    if (config) return 0xE2010001;
    opened++; told = background = 0; *made = &connection;
    return 0;
}
uint32_t LeapOpenConnection(void *c) { return c == &connection ? 0 : 0xE2010001; }
void LeapCloseConnection(void *c) { (void)c; }
void LeapDestroyConnection(void *c) { closed += c == &connection; }
uint32_t LeapSetPolicyFlags(void *c, uint64_t set, uint64_t clear) {
    (void)c; (void)clear; background = set == 1;
    return 0;
}
uint32_t LeapSetTrackingMode(void *c, int32_t mode) { (void)c; return mode != 0; }
uint32_t LeapPollConnection(void *c, uint32_t wait, LEAP_CONNECTION_MESSAGE *message) {
    (void)c; (void)wait;
    if (message->size != 20) return 0xE2010001;
    message->pointer = NULL;
    if (!told) { told = 1; message->type = 1; return 0; }
    if (!plugged) { message->type = 0x104; return 0; }
    if (!background || !next_frame()) return 0xE2010004;
    memset(hands, 0, sizeof hands);
    for (int h = 0; h < 2; h++) {
        LEAP_HAND *hand = &hands[h];
        hand->id = 5 + h; hand->type = 1 - h; hand->confidence = 0.5f;
        float x = (h ? -80.0f : 80.0f) + 10.0f * step;
        memcpy(hand->palm.position, (float[]){x, 200, 50}, 12);
        memcpy(hand->palm.normal, (float[]){0, -1, 0}, 12);
        memcpy(hand->palm.direction, (float[]){0, 0, -1}, 12);
        memcpy(hand->arm.next, (float[]){x, 190, 120}, 12);
        memcpy(hand->arm.prev, (float[]){x, 150, 350}, 12);
        for (int f = 0; f < 5; f++)
            for (int b = 0; b < 4; b++) {
                LEAP_BONE *bone = &hand->digits[f].bones[b];
                memcpy(bone->prev, (float[]){x + 20 * (f - 2), 200, 45 - 25 * b}, 12);
                memcpy(bone->next, (float[]){x + 20 * (f - 2), 200, 20 - 25 * b}, 12);
                if (f || b) bone->rotation[3] = 1;
            }
    }
    event = (LEAP_TRACKING_EVENT){{0, step, 9000ll * step}, step, 2, hands, 110};
    *message = (LEAP_CONNECTION_MESSAGE){20, 0x100, &event, 1};
    return 0;
}

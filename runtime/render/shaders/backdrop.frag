// The backdrop: a floor of boards with pools of light, and a three-striped curtain in the dark.
#include "frame.glsl"
#include "colour.glsl"
in vec2 place;
layout(location = 0) out vec4 picture_colour;

// Integer arithmetic: every driver makes the same boards.
float noise(vec2 cell) {
    uvec2 q = uvec2(ivec2(floor(cell))) * uvec2(1597334673u, 3812015801u);
    uint mixed = (q.x ^ q.y) * 1597334673u;
    mixed = (mixed ^ (mixed >> 15)) * 2246822519u;
    return float(mixed >> 8) / 16777216.0;
}

float smooth_noise(vec2 at) {
    vec2 cell = floor(at), t = fract(at);
    t = t * t * (3.0 - 2.0 * t);
    return mix(mix(noise(cell), noise(cell + vec2(1, 0)), t.x),
               mix(noise(cell + vec2(0, 1)), noise(cell + vec2(1, 1)), t.x), t.y);
}

vec3 boards(vec2 at, float footprint) {
    const float width = 0.17;
    float across = at.x / width;
    float board = floor(across);
    float shift = noise(vec2(board, 3.0));
    float length_cell = floor(at.y / 2.6 + shift * 7.0);
    float shade = noise(vec2(board, length_cell));
    float detail = clamp(0.02 / footprint, 0.0, 1.0);
    float grain = smooth_noise(vec2(at.x * 90.0, at.y * 3.0 + shade * 40.0)) - 0.5;
    float figure = smooth_noise(vec2(at.x * 14.0, at.y * 0.9 + shade * 60.0)) - 0.5;
    vec3 wood = mix(vec3(0.20, 0.098, 0.046), vec3(0.265, 0.142, 0.070), shade);
    wood *= 1.0 + 0.30 * grain * detail + 0.28 * figure;
    float gap = min(fract(across), 1.0 - fract(across)) * width;
    float gap_width = max(0.004, footprint * 0.7);
    return wood * mix(1.0, smoothstep(0.0, gap_width, gap), 0.75 * min(1.0, 0.004 / gap_width));
}

float pool_light(vec2 at) {
    float sum = 0.0;
    for (int i = 0; i < int(stage.w); ++i) {
        float d = length(at - pools[i].xy) / pools[i].z;
        sum += smoothstep(1.15, 0.60, d) * 0.95 + 0.34 * exp(-0.9 * d * d);
    }
    return 1.0 - exp(-1.15 * sum);
}

// Dust in the beams: along the ray, how close it comes to each beam's axis.
float beams(vec3 from, vec3 along, float until) {
    float sum = 0.0;
    for (int i = 0; i < int(stage.w); ++i) {
        vec3 foot = vec3(pools[i].x, 0.0, pools[i].y) - from;
        float c = dot(along, key.xyz), a = dot(along, foot), b = dot(key.xyz, foot);
        float ray = (a - c * b) / max(1.0 - c * c, 1e-3);
        ray = clamp(ray, 0.0, until);
        float height = max(dot(along * ray - foot, key.xyz), 0.0);
        float miss = length(along * ray - foot - key.xyz * height);
        float radius = pools[i].z * mix(0.85, 0.25, clamp(height / 7.0, 0.0, 1.0));
        sum += exp(-3.5 * miss * miss / (radius * radius)) * exp(-0.10 * height);
    }
    return sum;
}

vec3 curtain(vec3 at) {
    float around = atan(at.x - stage.x, -(at.z - stage.y)) * stage.z + picture.w;
    around += 0.03 * sin(at.y * 1.3 + around * 2.0);
    float stripe = fract(around / 1.8 + 0.5) * 3.0;
    float folds = sin(around * 17.0 + 1.3 * sin(around * 2.3)) * 0.5 + 0.5;
    folds = mix(folds, sin(around * 41.0 + 2.0 * sin(around * 5.9)) * 0.5 + 0.5, 0.22);
    vec3 black = vec3(0.020, 0.019, 0.026), persimmon = vec3(0.34, 0.095, 0.035);
    vec3 moss = vec3(0.060, 0.135, 0.075);
    vec3 cloth = mix(mix(black, persimmon, smoothstep(0.96, 1.04, stripe)), moss,
                     smoothstep(1.96, 2.04, stripe));
    cloth = mix(cloth, black, smoothstep(2.96, 3.0, stripe));
    float reach = exp(-0.60 * max(at.y, 0.0)) * 0.26 + 0.030;
    float sides = exp(-0.10 * pow(at.x - stage.x, 2.0) / max(stage.z, 1.0));
    return cloth * (0.16 + 1.05 * folds * folds) * reach * sides;
}

void main() {
    vec4 near = inverse_view_projection * vec4(place * 2.0 - 1.0, -1.0, 1.0);
    vec4 far = inverse_view_projection * vec4(place * 2.0 - 1.0, 1.0, 1.0);
    vec3 from = eye.xyz, along = normalize(far.xyz / far.w - near.xyz / near.w);

    vec2 rel = from.xz - stage.xy;
    float a = max(dot(along.xz, along.xz), 1e-6), b = dot(rel, along.xz);
    float inside = b * b - a * (dot(rel, rel) - stage.z * stage.z);
    float wall = (-b + sqrt(max(inside, 0.0))) / a;
    if (inside < 0.0) wall = 1e4;
    float ground = along.y < -1e-4 ? -from.y / along.y : 1e5;
    float until = min(wall, ground);
    vec3 at = from + along * until;

    vec3 light_out;
    if (ground < wall) {
        float footprint = ground / picture.z / max(-along.y, 0.05);
        float lit = pool_light(at.xz);
        vec3 warm = vec3(1.0, 0.80, 0.58) * 1.55 * lit + vec3(0.050, 0.052, 0.080);
        float back = smoothstep(stage.z, stage.z * 0.75, length(at.xz - stage.xy));
        light_out = boards(at.xz, footprint) * warm * mix(0.45, 1.0, back);
        light_out += vec3(0.030, 0.042, 0.070) * pow(1.0 + along.y, 12.0) * (0.2 + 0.8 * back);
    } else {
        light_out = curtain(at);
    }
    light_out += vec3(0.026, 0.020, 0.014) * beams(from, along, until);

    vec2 centred = place * 2.0 - 1.0;
    light_out *= 1.0 - 0.42 * smoothstep(0.35, 1.6, dot(centred, centred));
    float dither = noise(gl_FragCoord.xy) + noise(gl_FragCoord.yx + 17.0) - 1.0;
    picture_colour = vec4(encode(tone(light_out)) + dither / 255.0, 1.0);
}

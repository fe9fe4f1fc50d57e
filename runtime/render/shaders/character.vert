#include "frame.glsl"
uniform vec3 offset;
in vec3 in_position;
in vec3 in_normal;
in vec4 in_colour;
out vec3 world;
out vec3 normal;
out vec4 colour;
#ifdef TEXTURED
in vec2 in_uv;
out vec2 uv;
#endif
void main() {
    world = in_position + offset;
    normal = in_normal;
    colour = in_colour;
#ifdef TEXTURED
    uv = in_uv;
#endif
    gl_ClipDistance[0] = key.w > 0.5 ? world.y + 0.004 : 1.0;
    gl_Position = view_projection * vec4(world, 1.0);
}

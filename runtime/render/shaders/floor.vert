// The area of the floor with shadows and reflections, as two triangles.
#include "frame.glsl"
uniform float reach;
out vec2 place;
void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    vec2 size = 1.0 / floor_area.zw;
    vec2 at = floor_area.xy + corner * size + (corner * 2.0 - 1.0) * vec2(0.0, reach);
    place = (at - floor_area.xy) * floor_area.zw;
    gl_Position = view_projection * vec4(at.x, 0.0, at.y, 1.0);
}

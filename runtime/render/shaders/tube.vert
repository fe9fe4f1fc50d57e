// A bone or a joint as a flat capsule that always faces the viewer.
uniform mat4 to_clip;
uniform vec2 size;            // of the picture [px]
uniform float pixels;         // pixels of a metre at w = 1
uniform float least;          // thinnest radius [px]
uniform vec3 offset;
in vec4 in_from;              // xyz, radius [m]
in vec4 in_to;
in vec4 in_colour;            // linear rgb, opacity
in float in_glow;             // radii that the glow reaches beyond the capsule; 0: solid
flat out vec4 ends;           // both ends [px]
flat out vec2 radii;
flat out vec4 colour;
flat out float glow;

void main() {
    vec4 a = to_clip * vec4(in_from.xyz + offset, 1.0);
    vec4 b = to_clip * vec4(in_to.xyz + offset, 1.0);
    if (min(a.w, b.w) < 1e-3) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
    ends = vec4(a.xy / a.w * 0.5 + 0.5, b.xy / b.w * 0.5 + 0.5) * size.xyxy;
    radii = max(vec2(in_from.w / a.w, in_to.w / b.w) * pixels, least);
    colour = in_colour;
    glow = in_glow;
    vec2 axis = ends.zw - ends.xy;
    float span = length(axis);
    axis = span > 1e-4 ? axis / span : vec2(1.0, 0.0);
    float reach = max(radii.x, radii.y) * (1.0 + in_glow) + 1.5;
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
    vec2 at = corner.x < 0.0 ? ends.xy : ends.zw;
    at += reach * (corner.x * axis + corner.y * vec2(-axis.y, axis.x));
    gl_Position = vec4(at / size * 2.0 - 1.0, 0.0, 1.0);
}

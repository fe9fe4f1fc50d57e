// Depth only, for the shadow map and for the height map below the characters.
uniform mat4 to_clip;
uniform vec3 offset;
in vec3 in_position;
void main() { gl_Position = to_clip * vec4(in_position + offset, 1.0); }

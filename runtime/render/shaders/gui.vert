uniform vec2 size;            // of the picture [px]
in vec2 position;             // [px] from the upper left
in vec2 corner;
in vec4 tint;
out vec2 uv;
out vec4 colour;
void main() {
    uv = corner;
    colour = tint;
    gl_Position = vec4(position / size * vec2(2.0, -2.0) + vec2(-1.0, 1.0), 0.0, 1.0);
}

uniform sampler2D letters;
uniform vec4 ink;
in vec2 uv;
layout(location = 0) out vec4 premultiplied;
void main() { premultiplied = vec4(ink.rgb, 1.0) * (ink.a * texture(letters, uv).r); }

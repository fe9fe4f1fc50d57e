uniform sampler2D image;
in vec2 uv;
in vec4 colour;
layout(location = 0) out vec4 straight;
void main() { straight = colour * texture(image, uv); }

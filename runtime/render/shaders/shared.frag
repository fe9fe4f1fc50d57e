// Lays a picture of any size over the whole viewport.
uniform sampler2D image;
in vec2 place;
layout(location = 0) out vec4 picture_colour;
void main() { picture_colour = texture(image, place); }

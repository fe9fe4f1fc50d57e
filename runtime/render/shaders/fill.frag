// One colour over the whole picture; the blend function mixes it in.
uniform vec4 premultiplied;
layout(location = 0) out vec4 picture_colour;
void main() { picture_colour = premultiplied; }

// One colour over the whole picture; how it is mixed in is the blend function's.
uniform vec4 premultiplied;
layout(location = 0) out vec4 picture_colour;
void main() { picture_colour = premultiplied; }

// Lays the resolved characters over the picture.
uniform sampler2D image;
layout(location = 0) out vec4 picture_colour;
void main() { picture_colour = texelFetch(image, ivec2(gl_FragCoord.xy), 0); }

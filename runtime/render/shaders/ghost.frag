// Lays the resolved ghosts over the picture: washed with one colour, and see-through.
uniform sampler2D image;
uniform vec4 wash;  // a colour, encoded, and how much of it counts
uniform float opacity;
layout(location = 0) out vec4 picture_colour;
void main() {
    vec4 ghost = texelFetch(image, ivec2(gl_FragCoord.xy), 0);
    ghost.rgb = mix(ghost.rgb, wash.rgb * ghost.a, wash.a);
    picture_colour = opacity * ghost;
}

// The uniform block that all passes share; FRAME in runtime/render/frame.py has the same layout.
layout(std140) uniform Frame {
    mat4 view_projection;
    mat4 inverse_view_projection;
    mat4 light;          // world to the shadow map's clip space
    vec4 eye;            // w: +1, or -1 for the reflection in the floor
    vec4 key;            // direction towards the key light; w: 1 if there is a floor
    vec4 floor_area;     // least x, least z, 1 / width, 1 / depth of the floor mask
    vec4 stage;          // centre x, centre z, radius of the curtain, number of pools
    vec4 picture;        // width and height [px], pixels per metre at distance 1, slide of the cloth [m]
    vec4 pools[16];      // x, z, radius of each pool of light
};

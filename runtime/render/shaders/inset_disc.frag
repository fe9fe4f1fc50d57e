// The inset's disc: dark glass in a brass ring.
uniform vec3 disc;            // centre and radius [px]
layout(location = 0) out vec4 premultiplied;
void main() {
    vec2 at = (gl_FragCoord.xy - disc.xy) / disc.z;
    float d = length(at), pixel = 1.0 / disc.z;
    float inside = clamp((1.0 - d) / pixel + 0.5, 0.0, 1.0);
    float shadow = exp(-9.0 * max(d - 1.0, 0.0)) * 0.5;
    float ring = smoothstep(0.0, 1.5 * pixel, d - 0.945);
    vec3 glass = mix(vec3(0.150, 0.155, 0.200), vec3(0.050, 0.050, 0.070), d * d);
    glass += vec3(0.05) * smoothstep(0.75, -0.2, length(at - vec2(-0.35, 0.5)));
    float turn = 0.5 + 0.5 * dot(at / max(d, 1e-3), vec2(-0.55, 0.83));
    float bevel = 1.0 - abs((d - 0.972) / 0.030);
    vec3 brass = mix(vec3(0.30, 0.19, 0.08), vec3(0.98, 0.80, 0.48), turn * (0.35 + 0.65 * bevel));
    vec3 colour = mix(glass, brass, ring);
    float alpha = mix(shadow, mix(0.82, 1.0, ring), inside);
    premultiplied = vec4(colour * inside * alpha, alpha);
}

// Linear light to the screen.

// The shoulder of Khronos PBR Neutral without its toe: clear colours stay clear, darks stay soft,
// highlights roll off towards white.
vec3 tone(vec3 light) {
    const float start = 0.62, desaturation = 0.18;
    float peak = max(light.r, max(light.g, light.b));
    if (peak < start) return light;
    float span = 1.0 - start;
    float rolled = 1.0 - span * span / (peak + span - start);
    float kept = 1.0 / (desaturation * (peak - rolled) + 1.0);
    return mix(vec3(rolled), light * (rolled / peak), kept);
}

vec3 encode(vec3 light) {
    return max(1.055 * pow(max(light, 0.0), vec3(1.0 / 2.4)) - 0.055, 0.0);
}

// Where the display texels of a page of the atlas are, see app/render/resolve.py.
#define PLACES_WIDTH 256
uniform usampler2D t_shown_pages;  // the slot, from 1, of each page; 0 where no leaf is
uniform sampler2D t_places;        // per slot: display texel = z · uv + xy, z 0 for none; w: when its leaf was split off [s]

vec4 place_of(ivec2 page) {
    uint slot = texelFetch(t_shown_pages, page, 0).x;
    const uint width = uint(PLACES_WIDTH);  // of t_places
    return texelFetch(t_places, ivec2(slot % width, slot / width), 0);
}

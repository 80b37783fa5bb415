/* SPDX-License-Identifier: MIT
 *
 * The pad board's frame, in portable C (C99, C++, no library): what hardware/tactile/frame.py reads.
 *
 * On the wire: COBS(payload), 0x00. The payload is, least significant byte first,
 *
 *   version u8 | type u8 | sequence u16 | board time [us] u32 | n u8 | n x reading u16 | CRC-16
 *
 * with CRC-16/IBM-3740 (polynomial 0x1021, start 0xFFFF, no reflection) over all before it. A reading
 * of 65535 is the supply voltage, whatever the resolution of the converter.
 */
#ifndef PAD_FRAME_H
#define PAD_FRAME_H

#include <stddef.h>
#include <stdint.h>

#define PAD_FRAME_VERSION 1
#define PAD_FRAME_READINGS 1      /* the frame's type */
#define PAD_FRAME_MAX_INPUTS 32   /* raise it where more are needed, up to 120 */
#define PAD_FRAME_PAYLOAD(n) (9 + 2 * (n) + 2)
#define PAD_FRAME_SIZE(n) (PAD_FRAME_PAYLOAD(n) + 2) /* one COBS byte below 254 bytes, and the zero */

/* One byte more into the CRC, which starts at 0xFFFF. */
static uint16_t pad_frame_crc(uint16_t crc, uint8_t byte)
{
    uint32_t wide = crc ^ ((uint32_t)byte << 8);
    for (int bit = 0; bit < 8; ++bit)
        wide = (wide & 0x8000u) ? (wide << 1) ^ 0x1021u : wide << 1;
    return (uint16_t)wide;
}

/* COBS: each zero becomes the distance to the next one. Needs length < 254. Returns length + 1. */
static size_t pad_frame_cobs(const uint8_t *payload, size_t length, uint8_t *out)
{
    size_t code = 0; /* where the running block's distance goes */
    for (size_t i = 0; i < length; ++i) {
        out[i + 1] = payload[i];
        if (payload[i] == 0) {
            out[code] = (uint8_t)(i + 1 - code);
            code = i + 1;
        }
    }
    out[code] = (uint8_t)(length + 1 - code);
    return length + 1;
}

static uint8_t *pad_frame_put(uint8_t *at, uint32_t value, int bytes)
{
    for (int i = 0; i < bytes; ++i)
        *at++ = (uint8_t)(value >> (8 * i));
    return at;
}

/* Write one frame into out, which holds PAD_FRAME_SIZE(n) bytes. Returns its size, 0 if n is too large. */
static size_t pad_frame_encode(uint16_t sequence, uint32_t board_time_us, const uint16_t *readings,
                               uint8_t n, uint8_t *out)
{
    uint8_t payload[PAD_FRAME_PAYLOAD(PAD_FRAME_MAX_INPUTS)];
    uint8_t *at = payload;
    uint16_t crc = 0xFFFF;
    size_t size;

    if (n > PAD_FRAME_MAX_INPUTS)
        return 0;
    at = pad_frame_put(at, PAD_FRAME_VERSION, 1);
    at = pad_frame_put(at, PAD_FRAME_READINGS, 1);
    at = pad_frame_put(at, sequence, 2);
    at = pad_frame_put(at, board_time_us, 4);
    at = pad_frame_put(at, n, 1);
    for (uint8_t i = 0; i < n; ++i)
        at = pad_frame_put(at, readings[i], 2);
    for (const uint8_t *byte = payload; byte < at; ++byte)
        crc = pad_frame_crc(crc, *byte);
    at = pad_frame_put(at, crc, 2);
    size = pad_frame_cobs(payload, (size_t)(at - payload), out);
    out[size] = 0;
    return size + 1;
}

#endif

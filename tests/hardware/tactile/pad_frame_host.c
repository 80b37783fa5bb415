/* SPDX-License-Identifier: MIT
 * Reads lines "sequence time n reading...", writes the frames. */
#include <stdio.h>

#include "pad_frame.h"

int main(void)
{
    unsigned sequence, n, reading;
    unsigned long board_time_us;
    uint16_t readings[PAD_FRAME_MAX_INPUTS];
    uint8_t frame[PAD_FRAME_SIZE(PAD_FRAME_MAX_INPUTS)];

    while (scanf("%u %lu %u", &sequence, &board_time_us, &n) == 3) {
        for (unsigned i = 0; i < n; ++i) {
            if (scanf("%u", &reading) != 1)
                return 1;
            if (i < PAD_FRAME_MAX_INPUTS)
                readings[i] = (uint16_t)reading;
        }
        fwrite(frame, 1,
               pad_frame_encode((uint16_t)sequence, (uint32_t)board_time_us, readings, (uint8_t)n, frame),
               stdout);
    }
    return 0;
}

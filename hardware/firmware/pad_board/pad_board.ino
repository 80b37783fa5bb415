/* SPDX-License-Identifier: MIT
 *
 * Pad board: reads the tactile pads and sends one frame (pad_frame.h) every 20 ms over USB.
 *
 * Each input is a voltage divider: supply, reference resistor, analog pin, pad, ground. Choose each
 * reference resistor near the untouched resistance of its pad and write it into the hand's YAML file,
 * in the order of the pins below. Two pads in parallel share one pin.
 *
 * Written for a Teensy 4.1 (18 analog pins); a board with fewer pins reads a CD74HC4067 multiplexer:
 * set MULTIPLEXER to 1 and wire S0..S3 and SIG as below.
 */
#include "pad_frame.h"

#ifndef MULTIPLEXER
#define MULTIPLEXER 0
#endif

static const uint32_t PERIOD_US = 20000; /* 50 Hz */
static const uint32_t BAUD = 115200;     /* without effect on native USB */
static const uint8_t INPUTS = 14;        /* 12 finger pads, 2 palm links with 2 pads each */

/* Each value is the mean of some samples, as many as fit well into the period. */
#if defined(TEENSYDUINO) || defined(PAD_BOARD_12_BIT)
static const int ADC_BITS = 12;
static const int OVERSAMPLE = 16; /* x 14 inputs x 10 us = 2 ms */
#else
static const int ADC_BITS = 10;
static const int OVERSAMPLE = 4; /* x 14 inputs x 112 us = 6 ms on an AVR */
#endif

#if MULTIPLEXER
static const uint8_t SELECT[4] = {2, 3, 4, 5};
static const uint8_t SIGNAL = A0;
#else
static const uint8_t PINS[INPUTS] = {A0, A1, A2, A3, A4, A5, A6, A7, A8, A9, A10, A11, A12, A13};
#endif

static uint16_t sequence = 0;
static uint32_t next_us = 0;

static int sample(uint8_t input)
{
#if MULTIPLEXER
    for (uint8_t bit = 0; bit < 4; ++bit)
        digitalWrite(SELECT[bit], (input >> bit) & 1);
    delayMicroseconds(20); /* the divider charges the multiplexer's capacitance */
    return analogRead(SIGNAL);
#else
    return analogRead(PINS[input]);
#endif
}

/* Mean of several samples, scaled so that 65535 is the supply voltage. */
static uint16_t read_input(uint8_t input)
{
    const uint32_t full = (uint32_t)OVERSAMPLE * ((1UL << ADC_BITS) - 1);
    uint32_t sum = 0;
    for (int i = 0; i < OVERSAMPLE; ++i)
        sum += (uint32_t)sample(input);
    return (uint16_t)((sum * 65535ULL + full / 2) / full);
}

void setup()
{
    Serial.begin(BAUD);
#if MULTIPLEXER
    for (uint8_t bit = 0; bit < 4; ++bit)
        pinMode(SELECT[bit], OUTPUT);
#endif
#if defined(TEENSYDUINO)
    analogReadResolution(ADC_BITS);
#endif
    Serial.write((uint8_t)0); /* ends whatever a boot loader sent, so that the first frame counts */
    next_us = micros();
}

void loop()
{
    uint16_t readings[INPUTS];
    uint8_t frame[PAD_FRAME_SIZE(INPUTS)];

    if ((int32_t)(micros() - next_us) < 0)
        return;
    next_us += PERIOD_US; /* an absolute deadline: lateness does not add up */
    if ((int32_t)(micros() - next_us) > 0)
        next_us = micros() + PERIOD_US; /* a whole period late: do not send a burst */

    const uint32_t now = micros();
    for (uint8_t i = 0; i < INPUTS; ++i)
        readings[i] = read_input(i);
    const size_t size = pad_frame_encode(sequence++, now, readings, INPUTS, frame);
    Serial.write(frame, size); /* waits while nobody reads; the deadlines above then skip, not bunch */
}

/* SPDX-License-Identifier: MIT
 * Runs the sketch for two seconds of a made-up clock and writes what it sends. */
#include <cstdint>
#include <cstdio>
#include <cstdlib>

enum { A0, A1, A2, A3, A4, A5, A6, A7, A8, A9, A10, A11, A12, A13, OUTPUT };

static uint32_t clock_us = 0xFFFFFFFFu - 1000000u; /* the clock overflows after a second */
static int selected = 0;                           /* the multiplexer's input */

static uint32_t micros() { return clock_us += 1; }
static void delayMicroseconds(uint32_t duration) { clock_us += duration; }
static void pinMode(int, int) {}
static void analogReadResolution(int) {}
static void digitalWrite(int pin, int level)
{
    const int bit = 1 << (pin - 2);
    selected = level ? selected | bit : selected & ~bit;
}

/* Each input reads its number in percent of the supply, at the converter's resolution. */
static int analogRead(int pin);

struct {
    void begin(uint32_t) {}
    void write(uint8_t byte) { std::fputc(byte, stdout); }
    void write(const uint8_t *bytes, size_t size) { std::fwrite(bytes, 1, size, stdout); }
} Serial;

#include "pad_board.ino"

static int analogRead(int pin)
{
    clock_us += 10;
    return (MULTIPLEXER ? selected : pin) * ((1 << ADC_BITS) - 1) / 100;
}

int main()
{
    (void)pinMode, (void)delayMicroseconds, (void)digitalWrite, (void)analogReadResolution;
    const uint32_t start = clock_us;
    setup();
    while (clock_us - start < 2000000u)
        loop();
}

// The inverse and the controller from C++, freed by their destructors: closed_loop STAGE.json
#include <cmath>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "mpi_hyst.h"

namespace {

void check(mpih_status status) {
    if (status != MPIH_STATUS_OK) throw std::runtime_error(std::string(mpih_status_name(status)) + ": " + mpih_last_error());
}

template <auto end>
struct End {
    template <typename T>
    void operator()(T *object) const { end(object); }
};

using Stage = std::unique_ptr<mpih_stage, End<mpih_stage_free>>;
using Forward = std::unique_ptr<mpih_forward, End<mpih_forward_free>>;
using Inverse = std::unique_ptr<mpih_inverse, End<mpih_inverse_free>>;
using Controller = std::unique_ptr<mpih_controller, End<mpih_controller_free>>;

// The largest distance of a simulated stage in closed loop from a ramp.
double closed_loop(const mpih_stage *stage, double dt) {
    mpih_controller *made = nullptr;
    check(mpih_controller_new(stage, dt, nullptr, nullptr, 0, &made));
    const Controller controller(made);
    mpih_forward *simulated = nullptr;
    check(mpih_forward_new(stage, dt, nullptr, 0, &simulated));
    const Forward plant(simulated);
    double measured = mpih_forward_position(plant.get()), worst = 0.0;
    for (int k = 0; k < 20000; ++k) {
        const double reference = 20.0 * k / 20000;
        measured = mpih_forward_advance(plant.get(), mpih_controller_step(controller.get(), reference, measured));
        if (k > 1000) worst = std::fmax(worst, std::fabs(reference - measured));
    }
    return worst;
}

} // namespace

int main(int count, char **arguments) try {
    if (count != 2) throw std::runtime_error("closed_loop STAGE.json");
    mpih_stage *read = nullptr;
    check(mpih_stage_from_file(arguments[1], &read));
    const Stage stage(read);

    mpih_inverse *made = nullptr;
    check(mpih_inverse_new(stage.get(), 1e-4, NAN, NAN, nullptr, 0, &made));
    const Inverse inverse(made);
    std::vector<double> values{0.0, 5.0, 10.0, 15.0, 10.0, 5.0};
    check(mpih_inverse_run(inverse.get(), values.data(), values.data(), values.size()));
    for (const double drive : values) std::printf("%.3f V\n", drive);

    // What is wrong has a message.
    mpih_inverse *none = made;
    const mpih_status status = mpih_inverse_new(stage.get(), -1.0, NAN, NAN, nullptr, 0, &none);
    std::printf("%s: %s\n", mpih_status_name(status), mpih_last_error());
    const bool refused = status == MPIH_STATUS_ARGUMENT && none == nullptr;

    const double worst = closed_loop(stage.get(), 1e-4);
    std::printf("error at most %.2g um\n", worst);
    return refused && worst < 0.05 ? 0 : 1;
} catch (const std::exception &error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}

// Presses a cube with a tip and prints its force, as press.c does: Press SCENE STEPS PRINT_EVERY.

using System;
using System.Globalization;
using Palpate;

static class Press
{
    static int Main(string[] arguments)
    {
        if (arguments.Length != 3)
        {
            Console.Error.WriteLine("usage: Press SCENE STEPS PRINT_EVERY");
            return 2;
        }
        using (Simulation simulation = new Simulation(arguments[0]))
        {
            int finger = simulation.FindDevice("finger");
            if (finger < 0) throw new ArgumentException("the scene has no device \"finger\"");
            int steps = int.Parse(arguments[1]), every = int.Parse(arguments[2]);
            for (int i = 1; i <= steps; i++)
            {
                // From 10 mm above the cube down to 4 mm inside in 0.1 s, back, and again.
                double t = (i % 200) * simulation.StepSeconds;
                double depth = 0.14 * (t < 0.1 ? t : 0.2 - t);
                simulation.SetPosition(finger, new Vector(0.0, 0.0, 0.115 - depth));
                simulation.Step();
                if (i % every != 0) continue;
                Vector force = simulation.Output(finger).ForceOnHand;
                Console.WriteLine(string.Format(CultureInfo.InvariantCulture, "{0} {1:R} {2:R} {3:R} {4}", i, force.X, force.Y, force.Z, simulation.Contacts));
            }
            foreach (string warning in simulation.Warnings()) Console.Error.WriteLine("warning: " + warning);
            // The floor carries the cube and the finger.
            if (!(simulation.Obstacle(0).Force.Z < 0.0)) throw new InvalidOperationException("the floor carries nothing");
        }
        return 0;
    }
}
